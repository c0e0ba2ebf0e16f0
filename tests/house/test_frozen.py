"""`replace` of models and problems: their own fields, and those of the model inside, however deep."""

import pytest

from sdpgrind import units, weldbead
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
    assert changed.disc == DISC.replace(model=P1.model.replace(specific_energy=12.0), rotational_stiffness=5e5)
    assert changed.feed_rate == 10.0 and changed.bead == PASS.bead
    assert PASS.replace(idle_power=120.0).force_limit == PASS.replace(disc=DISC.replace(idle_power=120.0)).force_limit


def test_a_new_model_and_a_field_of_it():
    other = P1.model.replace(idle_power=50.0)
    assert P1.replace(model=other, specific_energy=12.0).model == other.replace(specific_energy=12.0)
    assert PASS.replace(disc=DISC.replace(model=other), specific_energy=12.0).disc.model == other.replace(specific_energy=12.0)


@pytest.mark.parametrize("thing", [P1, P1.model, DISC, PASS], ids=lambda thing: type(thing).__name__)
def test_unknown_names(thing):
    with pytest.raises(ValueError, match=rf"^{type(thing).__name__} has no field 'specific_enrgy'; is specific_energy meant\?$"):
        thing.replace(specific_enrgy=1.0)
    with pytest.raises(ValueError, match=r"has no field 'x1'; its fields are .*specific_energy"):
        thing.replace(x1=1.0)


def test_what_has_no_model_says_so():
    with pytest.raises(ValueError, match=r"Contour has no field 'model'; its fields are x, z"):
        PASS.bead.replace(model=3)


def test_a_value_that_is_none_is_refused_by_its_owner():
    with pytest.raises(ValueError, match=r"specific_energy must be > 0 \(J/mm\^3\); got -1\.0"):
        PASS.replace(specific_energy=-1.0)
