"""Control of `cycle`."""
