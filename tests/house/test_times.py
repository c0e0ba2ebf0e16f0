"""Tests are fast: those that are not are named at the end of a run, and marked ones are few."""

from types import SimpleNamespace

from house_names import ROOT

TESTS = ROOT / "tests"
MARK = "pytest.mark." + "slow"
MOST = 10  # chosen: more than ten tests above 5 s of CPU time would be a third of the time of the suite


def report(cpu, name="a", when="call"):
    return SimpleNamespace(user_properties=[("cpu", cpu)], nodeid=name, when=when)


def test_few_are_slow():
    marks = sum(path.read_text().count(MARK) for path in TESTS.rglob("test_*.py"))
    assert marks <= MOST


def test_slow_ones_are_named(pytestconfig):
    (told,) = (plugin.slow for plugin in pytestconfig.pluginmanager.get_plugins() if hasattr(plugin, "slow"))
    reports = [report(7.0, "b"), report(2.0), report(9.0), report(9.0, "c", "setup"), SimpleNamespace()]
    assert told(reports, 5.0) == ["   9.0 s  a", "   7.0 s  b"]
    assert told(reports, 10.0) == []
