"""What ``hwsim`` may say on standard error of a command that goes well, and what it draws."""

import re

import sdpgrind

SHARE = r"[ \d]{3} % .*\n"  # of a command that a busy machine takes more than 9 s for
NEWS = re.compile(
    r"hwsim: .* takes? (about|less than) \d+ s.*\n"
    r"|hwsim: (planning|searching a placement of the work|running \d+ \w+( twice)?|planning and running .*) \.\.\.\n"
    r"|hwsim: no roughness is told: .*\n"
    rf"|{SHARE}"
)


def only_news(error):
    """Whether there is nothing but what begins now, and how far it is."""
    return without_news(error) == ""


def without_news(error):
    """What was said of it afterwards."""
    return NEWS.sub("", error)


def without_shares(error):
    """What was said, line by line, but how far it is."""
    return re.sub(SHARE, "", error).splitlines()


class OutcomeAlone:
    """A log of which a report sees the outcome."""

    def __init__(self, outcome):
        self.outcome = outcome

    def __len__(self):
        return self.outcome.sizes["part"]


def pictures_of_page(folder, plan):
    """Number of pictures on the page of a run that a command kept, with the file of its plan; none is missing."""
    path = folder.parent / f"{folder.name}-drawn.html"
    sdpgrind.load(folder / "run.nc").report(path, plan=sdpgrind.load(folder / plan))
    page = path.read_text("utf-8")
    assert "left out" not in page and page.count("<path") > page.count("<svg")
    return page.count("<svg")
