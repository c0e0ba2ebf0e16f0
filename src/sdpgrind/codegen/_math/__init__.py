"""Elementary functions from C sources that a user names: what is reached, renamed, beside the export."""
