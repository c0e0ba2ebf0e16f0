"""Power, speed and torque of a disc whose speed droops under load, and the removal rate of a power."""

from typing import Any

from sdpgrind.base.units import N_MM_S_PER_W


def disk_torque(normal_force: Any, friction_ratio: Any, disk_radius: Any) -> Any:
    """Return the shaft torque of a normal force, F_t R = mu F_n R, N mm; Brown (1988), (4.4d).

    Parameters
    ----------
    normal_force : float or array
        Normal force, N.
    friction_ratio : float or array
        Tangential over normal force, unit 1.
    disk_radius : float or array
        Disc radius, mm.

    Examples
    --------
    >>> round(disk_torque(50.0, 0.3, 85.0), 9)
    1275.0
    """
    return friction_ratio * disk_radius * normal_force


def disk_speed(torque: Any, free_speed: Any, speed_droop: Any) -> Any:
    """Return the disc speed under a torque, omega = omega0 - beta torque, rad/s; Brown (1988), (4.8).

    Parameters
    ----------
    torque : float or array
        Shaft torque, N mm.
    free_speed : float or array
        Speed without load, rad/s.
    speed_droop : float or array
        Loss of speed per torque, rad/(s N mm).

    Examples
    --------
    >>> disk_speed(1000.0, 560.0, 0.1)
    460.0
    """
    return free_speed - speed_droop * torque


def disk_power(torque: Any, free_speed: Any, speed_droop: Any) -> Any:
    """Return the power at the contact, torque times speed, W, see `disk_speed`; Brown (1988), (4.4c), (4.8).

    Examples
    --------
    >>> disk_power(1275.0, 500.0, 0.0)
    637.5
    """
    return torque * disk_speed(torque, free_speed, speed_droop) / N_MM_S_PER_W


def removal_rate(grinding_power: Any, specific_energy: Any, idle_power: Any) -> Any:
    """Return the removal rate Q = (Pi - K2)/K1, mm^3/s, negative below K2; Brown (1988), (4.4a).

    Parameters
    ----------
    grinding_power : float or array
        Power at the contact, W.
    specific_energy : float or array
        Energy K1 to remove a volume, J/mm^3.
    idle_power : float or array
        Power K2 that removes nothing, W.

    Examples
    --------
    >>> removal_rate(637.5, 10.0, 100.0)
    53.75
    """
    return (grinding_power - idle_power) / specific_energy


def peak_torque(free_speed: Any, speed_droop: Any) -> Any:
    """Return the torque of greatest power, omega0/(2 beta), N mm; see `disk_speed`.

    Examples
    --------
    >>> round(peak_torque(560.0, 0.1), 9)
    2800.0
    """
    return free_speed / (2 * speed_droop)


def torque_of_power(grinding_power: Any, free_speed: Any, speed_droop: Any) -> Any:
    """Return the smaller torque of a `grinding_power`, W, N mm, exact for a small droop; see `disk_speed`.

    The power is at most 1e-3 omega0^2/(4 beta) W.

    Examples
    --------
    >>> torque_of_power(637.5, 500.0, 0.0)
    1275.0
    """
    power = grinding_power * N_MM_S_PER_W
    return 2 * power / (free_speed + (free_speed**2 - 4 * speed_droop * power) ** 0.5)
