"""The push of least time within limits of the tip: its search, and what is found."""
