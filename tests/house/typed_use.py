"""What a type checker must refuse; strict mypy fails where one of these is no error."""

import centering
from sdpgrind import physics, plunge
from sdpgrind.plunge import learning

centering.nothing  # type: ignore[attr-defined]  # noqa: B018  a wrong name of a face
centering.push.nothing  # type: ignore[attr-defined]  # noqa: B018
physics.BurningLimit(wrong=1.0)  # type: ignore[call-arg]  # a wrong field of a described class
plunge.Wear("much")  # type: ignore[arg-type]
physics.BurningLimit(6.205, 3.32).wrong  # type: ignore[attr-defined]  # noqa: B018
learning.CarriedState("much")  # type: ignore[call-arg]
