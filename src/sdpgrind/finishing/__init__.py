"""Robot-assisted finishing: paths over curved surfaces, joints and time laws, a torque axis, designed experiments (Wang and Jan 2001)."""

__all__: list[str] = []
