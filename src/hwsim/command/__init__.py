"""The command line: jobs, folders of runs, exit statuses, times, files checked; a folder for each area."""
