"""Models and problems are frozen dataclasses; `replace` makes a changed copy and knows the fields of the model inside."""

import dataclasses
from typing import Any, Self


class Frozen:
    """Base of frozen dataclasses with ``replace``."""

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Parameters
        ----------
        **changes
            Fields of this object, in their own units; where it has a ``model``, the model's fields too.

        Raises
        ------
        ValueError
            When a name is a field of neither.
        """
        own = {field.name for field in dataclasses.fields(self)}  # type: ignore[arg-type]
        inner = {name: changes.pop(name) for name in list(changes) if name not in own}
        if inner:
            changes["model"] = self._replaced_model(changes.get("model"), inner, own)
        return dataclasses.replace(self, **changes)  # type: ignore[type-var]

    def _replaced_model(self, model: Any, inner: dict[str, Any], own: set[str]) -> Any:
        model = model if model is not None else getattr(self, "model", None)
        known = {field.name for field in dataclasses.fields(model)} if model is not None else set()
        for name in inner:
            if name not in known:
                fields = ", ".join(sorted(own | known))
                raise ValueError(f"{type(self).__name__} has no field {name!r}; its fields are {fields}")
        return model.replace(**inner)
