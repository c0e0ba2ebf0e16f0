"""`replace` of models and problems: their own fields, and those of the model inside, however deep."""

import dataclasses
from typing import ClassVar

import pytest

from sdpgrind import units, weldbead
from sdpgrind.base.frozen import Frozen
from sdpgrind.weldbead import passes

P1 = weldbead.preset("P1")
DISC = passes.TiltedDisc(P1.model, relaxed_angle=units.deg(20.0), rotational_stiffness=6e5)
PASS = passes.PassProblem(DISC, passes.Contour([0, 75, 150], [1.0, 1.3, 1.0]), mean_cut=0.2, feed_rate=20.0)


def test_own_fields_and_those_of_the_model():
    changed = P1.replace(specific_energy=12.0, force_max=40.0)
    assert changed.model == P1.model.replace(specific_energy=12.0) and changed.force_max == 40.0
    assert changed.replace(specific_energy=10.0, force_max=50.0) == P1 and P1.model.specific_energy == 10.0


def test_a_pass_reaches_its_disc_and_the_process_in_it():
    changed = PASS.replace(specific_energy=12.0, rotational_stiffness=5e5, feed_rate=10.0)
    assert changed.disc == DISC.replace(
        model=P1.model.replace(specific_energy=12.0), rotational_stiffness=5e5
    )
    assert changed.feed_rate == 10.0 and changed.bead == PASS.bead
    assert (
        PASS.replace(idle_power=120.0).force_limit
        == PASS.replace(disc=DISC.replace(idle_power=120.0)).force_limit
    )


def test_a_new_model_and_a_field_of_it():
    other = P1.model.replace(idle_power=50.0)
    assert P1.replace(model=other, specific_energy=12.0).model == other.replace(specific_energy=12.0)
    assert PASS.replace(disc=DISC.replace(model=other), specific_energy=12.0).disc.model == other.replace(
        specific_energy=12.0
    )


@pytest.mark.parametrize("thing", [P1, P1.model, DISC, PASS], ids=lambda thing: type(thing).__name__)
def test_unknown_names(thing):
    with pytest.raises(
        ValueError,
        match=rf"^{type(thing).__name__} has no field 'specific_enrgy'; is specific_energy meant\?$",
    ):
        thing.replace(specific_enrgy=1.0)
    with pytest.raises(ValueError, match=r"has no field 'x1'; its fields are .*specific_energy"):
        thing.replace(x1=1.0)


def test_what_has_no_model_says_so():
    with pytest.raises(ValueError, match=r"Contour has no field 'model'; its fields are x, z"):
        PASS.bead.replace(model=3)


def test_a_value_that_is_none_is_refused_by_its_owner():
    with pytest.raises(ValueError, match=r"specific_energy must be > 0 \(J/mm\^3\); got -1\.0"):
        PASS.replace(specific_energy=-1.0)


@dataclasses.dataclass(frozen=True)
class Wheel(Frozen):
    width: float
    mass: float = 1.0


@dataclasses.dataclass(frozen=True)
class Cart(Frozen):
    model: Wheel
    limits: Wheel | None
    load: P1.model.__class__
    _inside: ClassVar[tuple[str, ...]] = ("model", "limits", "load")


CART = Cart(Wheel(2.0), None, P1.model)


def test_several_things_inside_are_reached_together():
    changed = CART.replace(width=3.0, specific_energy=12.0, mass=4.0)
    assert changed == Cart(Wheel(3.0, 4.0), None, P1.model.replace(specific_energy=12.0))
    assert CART.replace(model=Wheel(9.0), mass=5.0).model == Wheel(9.0, 5.0)
    with pytest.raises(ValueError, match=r"Cart has no field 'specific_enrgy'; is specific_energy meant\?"):
        CART.replace(specific_enrgy=1.0)


def test_what_is_in_two_of_them_is_refused():
    both = CART.replace(limits=Wheel(1.0))
    with pytest.raises(
        ValueError, match="Cart has 'width' in model and in limits; replace the one that is meant"
    ):
        both.replace(width=3.0)
    assert both.replace(limits=both.limits.replace(width=3.0)).limits.width == 3.0
