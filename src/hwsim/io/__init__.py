"""Users' files as the tables of a log, and tables as files: columns, parts, commands, origin."""
