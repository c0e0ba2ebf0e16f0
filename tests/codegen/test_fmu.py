"""FMUs by an independent master (FMPy): description, bits, states, instances, refusals."""

import shutil
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import fmu_things as things
import numpy as np
import pytest
from codegen_inside import base_unit, compilers, model_description
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from fmu_things import THINGS, Unit, answers, exported, low_pass, rows

import sdpgrind
from hwsim.cli import main

pytestmark = [
    pytest.mark.skipif(not shutil.which("gcc"), reason="gcc is not installed"),
    pytest.mark.usefixtures("few_blocks"),
]
every = pytest.mark.parametrize("name", THINGS)


def bits(numbers):
    """Bits of doubles, those of one NaN for all of them."""
    return np.where(np.isnan(numbers), np.nan, numbers).view(np.int64)


@pytest.fixture
def unit():
    """Factory of instances, which are freed at the end."""
    made = []

    def make(name, **given):
        made.append(Unit(name, **given))
        return made[-1]

    yield make
    for one in made:
        one.close()


def refused(unit, words):
    """Refuse by the message alone, of an instance that goes on."""
    assert len(unit.messages) == 1 and words in unit.messages[0], unit.messages
    unit.messages.clear()


@every
def test_the_description_is_valid(name):
    assert validate_fmu(str(exported(name).path)) == []


@every
def test_bits_are_those_of_the_library(unit, name):
    wanted, states = answers(name)
    one = unit(name)
    found = one.taken(rows(name))
    assert len(found) > 350 and (bits(found) == bits(wanted)).all()
    assert (bits(one.state()) == bits(states[-1])).all()


@every
def test_a_state_that_was_stored_goes_on_alike(unit, name):
    """As an object, and as bytes that another instance reads."""
    given = rows(name, seed=1)
    one, other = unit(name), unit(name)
    one.taken(given[:150])
    kept, then = one.slave.getFMUstate(), one.time
    packed = one.slave.serializeFMUstate(kept)
    first = one.taken(given[150:300])
    one.slave.setFMUstate(kept)
    one.time = then
    assert (bits(one.taken(given[150:300])) == bits(first)).all()
    read = other.slave.deSerializeFMUstate(packed)
    other.slave.setFMUstate(read)
    other.time = then
    assert (bits(other.taken(given[150:300])) == bits(first)).all()
    assert (bits(first) == bits(answers(name, seed=1)[0][150:300])).all()
    for held in (kept, read):
        one.slave.freeFMUstate(held)
        assert held.value is None


@every
def test_two_instances_are_apart(unit, name):
    """Their steps alternate; one is reset on its way."""
    first, second = rows(name), rows(name, seed=2)
    one, other = unit(name), unit(name)
    for k in range(100):
        one.stepped(first[k])
        other.stepped(second[k])
    one.slave.reset()
    one.begin()
    assert len(one.messages) == (answers(name)[0][:100, -1] < 0).sum()
    found = np.array([(one.stepped(a), other.stepped(b)) for a, b in zip(first, second[100:], strict=False)])
    assert (bits(found[:, 0]) == bits(answers(name)[0][: len(found)])).all()
    assert (bits(found[:, 1]) == bits(answers(name, seed=2)[0][100 : 100 + len(found)])).all()


@every
def test_outputs_before_the_first_step_are_zero(unit, name):
    one = unit(name)
    assert not one.outputs().any()
    one.stepped(rows(name)[0])
    one.slave.reset()
    assert not one.outputs().any()


@pytest.mark.parametrize("name", ["low_pass", "stages"])
def test_a_step_of_another_length_is_refused(unit, name):
    one = unit(name, start=3.0)
    given, wanted = rows(name), answers(name)[0]
    found = [one.stepped(row) for row in given[:20]]
    for wrong in (2.0 * one.period, 0.5 * one.period, 1.001 * one.period, 0.0, -one.period, np.nan, np.inf):
        with pytest.raises(FMICallException):
            one.slave.doStep(currentCommunicationPoint=one.time, communicationStepSize=wrong)
        refused(one, f"must be the period, {one.period!r} s; got ")
    with pytest.raises(FMICallException):  # a step is missing
        one.slave.doStep(currentCommunicationPoint=one.time + one.period, communicationStepSize=one.period)
    refused(one, "must be the end of the step before")
    found += [one.stepped(row) for row in given[20:40]]
    assert (bits(np.array(found)) == bits(wanted[:40])).all()


def test_lengths_are_compared_as_masters_add_up_times(unit):
    """The end of a step is k times the period, its length a difference of two such numbers."""
    day, period = 86400.0, 0.001
    one, lengths = unit("low_pass", start=day), []
    for k in range(1000):
        begin, end = day + k * period, day + (k + 1) * period
        lengths.append(end - begin)
        one.slave.doStep(currentCommunicationPoint=begin, communicationStepSize=end - begin)
    assert max(np.abs(np.array(lengths) / period - 1.0)) > 1e-9
    assert one.slave.getRealStatus(2) == pytest.approx(day + 1.0, rel=1e-15)


def test_a_look_up_takes_steps_of_any_length(unit):
    one = unit("table")
    assert one.description.coSimulation.canHandleVariableCommunicationStepSize
    for length in (0.0, 1e-3, 7.5):
        one.give(rows("table")[0])
        one.slave.doStep(currentCommunicationPoint=one.time, communicationStepSize=length)
    for wrong in (-1.0, np.nan):
        with pytest.raises(FMICallException):
            one.slave.doStep(currentCommunicationPoint=one.time, communicationStepSize=wrong)
        refused(one, "must be finite and >= 0; got ")


def test_a_missing_reading_is_told_by_its_flag(unit):
    """The value beside it does not count then; NaN itself is no reading, too."""
    flagged, by_value, plain = unit("low_pass"), unit("low_pass"), unit("low_pass")
    for one in (flagged, by_value, plain):
        one.stepped((2.0, 1.0))
    reference = flagged.references
    flagged.slave.setBoolean([reference["pull_valid"]], [False])
    flagged.slave.setReal([reference["pull"]], [50.0])
    by_value.slave.setReal([reference["pull"]], [np.nan])
    for one in (flagged, by_value, plain):
        one.advance()
    assert (flagged.outputs() == by_value.outputs()).all() and flagged.outputs()[-1] == 1.0
    assert plain.outputs()[-1] == 0.0 and plain.outputs()[0] > flagged.outputs()[0]
    assert flagged.slave.getBoolean([reference["pull_valid"]]) == [False]
    assert flagged.slave.getReal([reference["pull"], reference["weight"]]) == [50.0, 1.0]


@pytest.mark.parametrize("wrong", [-1.0, 11.0, np.nan, np.inf])
def test_an_input_out_of_range_leaves_the_state(unit, wrong):
    one = unit("low_pass")
    one.stepped((2.0, 1.0))
    before, shown = one.state(), one.outputs()
    one.slave.setReal([one.references["weight"]], [wrong])
    with pytest.raises(FMICallException):
        one.advance()
    refused(one, "inputs must be as their meanings say, finite and within their range")
    assert (one.state() == before).all() and (one.outputs() == shown).all()
    one.stepped((2.0, 1.0))


def test_calls_out_of_order_and_strange_references_are_refused(unit):
    one = unit("low_pass")
    slave, reference = one.slave, one.references
    calls = {
        "must be that of a Real; got 99": lambda: slave.getReal([99]),
        "must be that of a Real input; got": lambda: slave.setReal([reference["pressing"]], [1.0]),
        "must be that of a Boolean input; got": lambda: slave.setBoolean(
            [reference["pull_valid"] + 1], [True]
        ),
        "must be that of a Boolean; got": lambda: slave.getBoolean([reference["pull"]]),
        "must be that of the status; got": lambda: slave.getInteger([reference["pull"]]),
        "fmi2SetupExperiment must come before": lambda: slave.setupExperiment(startTime=1.0),
        "fmi2EnterInitializationMode must come once": slave.enterInitializationMode,
        "fmi2ExitInitializationMode must come after": slave.exitInitializationMode,
        "there is none to cancel": slave.cancelStep,
        "a state of this FMU": lambda: slave.deSerializeFMUstate(b"0" * 100),
    }
    for words, call in calls.items():
        with pytest.raises(FMICallException):
            call()
        refused(one, words)
    held = slave.getFMUstate()
    foreign = b"0" * 16 + slave.serializeFMUstate(held)[16:]  # of another plan, as long
    slave.freeFMUstate(held)
    with pytest.raises(FMICallException):
        slave.deSerializeFMUstate(foreign)
    refused(one, "a state of this FMU, fingerprint " + one.recipe.fingerprint)
    slave.terminate()
    with pytest.raises(FMICallException):
        one.advance()
    refused(one, "fmi2DoStep must come after")


def test_another_description_is_refused():
    with pytest.raises(Exception, match="Failed to instantiate"):
        Unit("low_pass", guid="{00000000-0000-0000-0000-000000000000}")


def test_a_master_of_its_own_gives_the_same():
    """`fmpy.simulate_fmu` over the default experiment, inputs as a table."""
    given = rows("low_pass")
    period, count = 0.001, 300
    names = [("time", float), ("pull", float), ("weight", float), ("pull_valid", bool)]
    table = np.zeros(count, dtype=names)
    table["time"], table["pull"], table["weight"] = np.arange(count) * period, *given[:count].T
    table["pull_valid"] = True
    wanted = answers("low_pass")[0]
    found = fmpy.simulate_fmu(
        str(exported("low_pass").path), input=table, stop_time=(count - 1) * period, output_interval=period
    )
    assert found["pressing"][0] == 0.0 and (found["pressing"][1:] == wanted[: count - 1, 0]).all()


def test_units_and_words_stand_in_the_description():
    description, _ = things.described("table")
    units = {one.name: one.baseUnit for one in description.unitDefinitions}
    assert set(units) == {"mm", "N", "mm^3/(mm*min)"}
    assert (units["mm"].factor, units["mm"].m) == (0.001, 1)
    assert (units["N"].factor, units["N"].kg, units["N"].m, units["N"].s) == (1.0, 1, 1, -2)
    rate = units["mm^3/(mm*min)"]
    assert rate.factor == pytest.approx(1e-6 / 60.0, rel=1e-15) and (rate.m, rate.s) == (2, -1)
    variables = {one.name: one for one in description.modelVariables}
    assert all(one.variability == "discrete" and one.description for one in variables.values())
    assert variables["depth_of_cut"].unit == "mm" and "depth_of_cut_valid" not in variables
    items = {item.name for one in description.typeDefinitions for item in one.items}
    assert items == set(exported("table").recipe.status)


def test_the_fixed_step_is_the_period():
    described, _ = things.described("low_pass")
    assert float(described.defaultExperiment.stepSize) == exported("low_pass").recipe.period
    assert not described.coSimulation.canHandleVariableCommunicationStepSize


@pytest.mark.parametrize(
    ("unit", "wanted"),
    [
        ("N mm", {"m": "2", "s": "-2", "kg": "1", "factor": "0.001"}),
        ("rad/s", {"s": "-1", "rad": "1"}),
        ("mA", {"A": "1", "factor": "0.001"}),
        ("$/mm", None), ("mm^0.5", None), ("lumps", None),
    ],
)  # fmt: skip
def test_base_units(unit, wanted):
    assert base_unit(unit) == wanted


def test_text_is_escaped_and_ascii():
    told = 'a < b & "c" \x07\n λ = 1 mm²'
    recipe = low_pass(equations=told)
    text = model_description(recipe, "low_pass", "1", "{x}", ["low_pass.c"])
    assert text.isascii()
    root = ElementTree.fromstring(text)
    assert root.get("description").endswith('a < b & "c" λ = 1 mm²')


def test_names_that_occur_twice_are_refused(tmp_path):
    recipe = low_pass(outputs={"status": "", "rest": ""})
    with pytest.raises(ValueError, match="outputs and status must be without repeats; got 'status' twice"):
        sdpgrind.export(recipe, tmp_path / "low.fmu", target="fmi2")
    assert not list(tmp_path.iterdir())


def test_an_input_that_is_named_as_an_output(tmp_path):
    """As the coordinate of a controller on a locus: a variable of an FMU has one direction."""
    place = tmp_path / "low.fmu"
    sdpgrind.export(low_pass(outputs={"pull": "N", "rest": ""}), place, target="fmi2")
    told = {one.name: one.causality for one in fmpy.read_model_description(str(place)).modelVariables}
    assert told["pull_measured"] == "input" and told["pull"] == "output" and validate_fmu(str(place)) == []


def test_the_archive_is_the_same_again(tmp_path):
    first = exported("low_pass").path.read_bytes()
    sdpgrind.export(low_pass(), tmp_path / "low_pass.fmu", target="fmi2")
    assert (tmp_path / "low_pass.fmu").read_bytes() == first
    with zipfile.ZipFile(tmp_path / "low_pass.fmu") as archive:
        names = archive.namelist()
        assert names == sorted(names) and {one.date_time for one in archive.infolist()} == {
            (1980, 1, 1, 0, 0, 0)
        }
        text = b"".join(map(archive.read, names))
    assert str(tmp_path).encode() not in text and str(Path.home()).encode() not in text
    assert "binaries/linux64/low_pass.so" in names


def test_a_path_with_other_content_is_kept(tmp_path):
    path = tmp_path / "low.fmu"
    first = sdpgrind.export(low_pass(), path, target="fmi2")
    before = path.read_bytes()
    with pytest.raises(FileExistsError, match="overwrite must be True"):
        sdpgrind.export(low_pass(share=0.25), path, target="fmi2")
    assert path.read_bytes() == before
    second = sdpgrind.export(low_pass(share=0.25), path, target="fmi2", overwrite=True)
    assert first.manifest["fmi"]["guid"] != second.manifest["fmi"]["guid"]
    assert first.manifest["fingerprint"] != second.manifest["fingerprint"]
    assert [one.name for one in tmp_path.iterdir()] == ["low.fmu"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_unit_of_another_maker_is_kept(tmp_path, overwrite):
    """One with other files, one with a manifest of its own, and one of ours to which notes were added."""
    description = {"modelDescription.xml": b"<fmiModelDescription/>"}
    other = {**description, "resources/manifest.json": b'{"files": {"modelDescription.xml": ""}}'}
    with zipfile.ZipFile(exported("low_pass").path) as archive:
        added = {one: archive.read(one) for one in archive.namelist()} | {"documentation/notes.txt": b"mine"}
    made = "that sdpgrind.export wrote"
    for k, (files, words) in enumerate(
        ((description, made), (other, made), (added, "documentation/notes.txt"))
    ):
        path = tmp_path / f"unit_{k}.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in files.items():
                archive.writestr(name, content)
        before = path.read_bytes()
        with pytest.raises(ValueError, match=words):
            sdpgrind.export(low_pass(), path, target="fmi2", overwrite=overwrite)
        assert path.read_bytes() == before


def test_wrong_paths(tmp_path):
    (tmp_path / "text.fmu").write_text("notes")
    for path, words in (("low.zip", r"end in \.fmu"), ("text.fmu", "be an FMU, or not exist yet")):
        with pytest.raises(ValueError, match=words):
            sdpgrind.export(low_pass(), tmp_path / path, target="fmi2", overwrite=True)
    with pytest.raises(NotADirectoryError, match=r"lies in the file .*text\.fmu"):
        sdpgrind.export(low_pass(), tmp_path / "text.fmu" / "low.fmu", target="fmi2")
    assert sdpgrind.export(low_pass(), tmp_path / "out" / "low.fmu", target="fmi2").path.is_file()
    with pytest.raises(ValueError, match="identifier of C"):
        sdpgrind.export(low_pass(), tmp_path / "1st.fmu", target="fmi2")


def test_the_c_in_an_fmu_is_checked_and_controls():
    made = exported("low_pass")
    found = made.check(2000, ["gcc"], levels=["-O1"], targets=())
    assert found.status == "equal" and found.differing == 0 and made.size > 1000
    controller, given = made.controller(), rows("low_pass")[:5]
    told = [controller.step(pull=pull, weight=weight)["pressing"] for pull, weight in given]
    assert told == list(answers("low_pass")[0][:5, 0])


def test_without_a_compiler_there_are_sources_only(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(compilers.shutil, "which", lambda command: None)
        with pytest.warns(UserWarning, match="sources only, no binary: gcc was not found"):
            made = sdpgrind.export(low_pass(), tmp_path / "low_pass.fmu", target="fmi2")
    told = {
        **exported("low_pass").manifest["fmi"],
        "binaries": [],
        "no_binary": "gcc was not found on this computer",
    }
    assert made.manifest["fmi"] == told
    assert validate_fmu(str(made.path)) == []
    assert fmpy.supported_platforms(str(made.path)) == ["c-code"]


def test_a_saved_policy_becomes_an_fmu_by_the_command(tmp_path, capsys):
    things.bead().save(tmp_path / "bead.nc")
    path = tmp_path / "bead.fmu"
    assert main(["export", str(tmp_path / "bead.nc"), str(path), "--target", "fmi2"]) == 0
    assert f"{path}: binaries/linux64, bead.h, bead.c (" in capsys.readouterr().out
    assert path.read_bytes() == exported("bead").path.read_bytes()


def test_sources_are_listed_strict_and_stand_in_one_program(tmp_path):
    """As the descriptions list them; with a prefix no name of one FMU is that of another."""
    fmpy.extract(str(exported("low_pass").path), str(tmp_path))
    description = fmpy.read_model_description(str(tmp_path))
    listed = description.buildConfigurations[0].sourceFileSets[0].sourceFiles
    again = fmpy.model_description.read_build_description(str(tmp_path))
    assert again[0].sourceFileSets[0].sourceFiles == listed == ["low_pass.c", "low_pass_fmu.c"]
    source, made = tmp_path / "sources" / listed[1], tmp_path / "shell.o"
    for compiler in compilers.found(("gcc", "clang"))[0]:
        strict = [compiler, "-std=c99", "-ffp-contract=off", *compilers.STRICT, "-DFMI2_FUNCTION_PREFIX=one_"]
        subprocess.run([*strict, "-c", source, "-o", made], check=True)
    if shutil.which("nm"):
        shown = subprocess.run(
            ["nm", "-g", "--defined-only", made], capture_output=True, text=True, check=True
        )
        assert {line.split()[-1][:8] for line in shown.stdout.splitlines()} == {"one_fmi2"}
        binary = tmp_path / "binaries" / "linux64" / "low_pass.so"
        shown = subprocess.run(
            ["nm", "-D", "--defined-only", binary], capture_output=True, text=True, check=True
        )
        assert {line.split()[-1][:4] for line in shown.stdout.splitlines()} == {"fmi2"}


MASTER = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "low_pass_fmu.c"

static void shown(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                  fmi2String category, fmi2String message, ...)
{
    (void)environment;
    (void)status;
    printf("%s %s %s\\n", instance, category, message);
}

int main(void)
{
    fmi2CallbackFunctions calls = {shown, NULL, NULL, NULL, NULL};
    fmi2ValueReference references[2] = {0U, 1U};
    double given[2] = {2.0, 1.0};
    double first[2];
    double again[2];
    size_t size;
    char *bytes;
    fmi2FMUstate kept = NULL;
    fmi2FMUstate read = NULL;
    fmi2Component one = fmi2Instantiate("one", fmi2CoSimulation, UNIT_GUID, "", &calls, 0, 0);
    fmi2ValueReference out[2] = {2U, 3U};
    if (fmi2Instantiate("two", fmi2CoSimulation, "other", "", &calls, 0, 0) != NULL) {
        return 1;
    }
    (void)fmi2SetupExperiment(one, 0, 0.0, 0.0, 0, 0.0);
    (void)fmi2EnterInitializationMode(one);
    (void)fmi2ExitInitializationMode(one);
    (void)fmi2SetReal(one, references, 2U, given);
    (void)fmi2GetFMUstate(one, &kept);
    (void)fmi2SerializedFMUstateSize(one, kept, &size);
    bytes = malloc(size);
    (void)fmi2SerializeFMUstate(one, kept, bytes, size);
    (void)fmi2DoStep(one, 0.0, PERIOD, 0);
    (void)fmi2GetReal(one, out, 2U, first);
    (void)fmi2DeSerializeFMUstate(one, bytes, size, &read);
    (void)fmi2SetFMUstate(one, read);
    (void)fmi2DoStep(one, 0.0, PERIOD, 0);
    (void)fmi2GetReal(one, out, 2U, again);
    (void)fmi2FreeFMUstate(one, &kept);
    (void)fmi2FreeFMUstate(one, &read);
    fmi2FreeInstance(one);
    free(bytes);
    return memcmp(first, again, sizeof first);
}
"""


def test_a_master_in_c_finds_nothing_leaked_or_undefined(tmp_path):
    fmpy.extract(str(exported("low_pass").path), str(tmp_path))
    sources, program = tmp_path / "sources", tmp_path / "master"
    (sources / "master.c").write_text(MASTER)
    sanitized = ["gcc", "-std=c99", "-O1", "-ffp-contract=off", "-fsanitize=address,undefined"]
    units = [str(sources / file) for file in ("low_pass.c", "master.c")]
    built = subprocess.run(
        [*sanitized, *units, "-lm", "-o", program], capture_output=True, text=True, check=False
    )
    if "cannot find" in built.stderr:
        pytest.skip("sanitizers of gcc are not installed")
    assert built.returncode == 0, built.stderr
    told = subprocess.run([program], capture_output=True, text=True, check=False)
    assert (told.returncode, told.stderr) == (0, "")
    assert told.stdout.startswith("two logStatusError fmuGUID must be {") and told.stdout.count("\n") == 1
