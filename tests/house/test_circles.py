"""No circles of modules: what a module imports, anywhere in it, does not lead back to it."""

import ast

from house_names import SOURCE, modules

LEFT = {
    "centering.roundness": ["profile profile_steps"],
    "sdpgrind.finishing.study": ["report study"],
    "sdpgrind.locus": ["_loss_table _robust", "_problem _problem_text _system"],
}
"""Circles that are still there, by their folder. Do not add any."""


def graph():
    """Modules that each module imports: at its top, for type checkers, in functions; not faces of packages."""
    plain = {name: path for name in modules() if (path := SOURCE.joinpath(*name.split(".")).with_suffix(".py")).exists()}
    return {name: set(imported(path.read_text(), plain)) - {name} for name, path in plain.items()}


def imported(text, known):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from (name if name in known else node.module for name in names if name in known or node.module in known)


def reached(arrows, start):
    """Everything that a module imports, or what it imports imports."""
    found, new = set(), set(arrows[start])
    while new:
        found |= new
        new = set().union(*(arrows[name] for name in new)) - found
    return found


def circles(arrows):
    """Groups of modules that import each other."""
    reach = {name: reached(arrows, name) for name in arrows}
    return {frozenset(other for other in reach[name] if name in reach[other]) for name in arrows if name in reach[name]}


def test_no_circle_but_those_that_are_left():
    left = {frozenset(f"{home}.{name}" for name in each.split()) for home, rings in LEFT.items() for each in rings}
    assert circles(graph()) == left


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == {frozenset("abc")}
    text = "if TYPE_CHECKING:\n    from x import y\ndef f():\n    import z.w\nfrom x.y import name"
    assert set(imported(text, {"x.y", "z.w", "x"})) == {"x.y", "z.w"}
