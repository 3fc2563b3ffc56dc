"""The command line: arguments in, exit codes out, no thoughts of its own.

| file | holds |
|---|---|
| `app.py` | the command tree; every command imports its rooms when it runs, so `--help` is quick |
| `job_commands.py`, `judge_commands.py`, `nc_commands.py` | the commands: each a frozen value |
| `options.py` | `command`: a dataclass as a command; options that several commands have |
| `main.py` | `main`: exceptions -> one message and an exit code |
| `screen.py` | progress bar and messages on stderr, JSON on stdout |
| `jobs.py`, `demo.py`, `batch.py` | init, run, measure, merge, check, contact; demo; batch |
| `nc.py`, `single.py` | nc check, nc moves; sweep |
| `dda.py`, `engage.py`, `machine.py` (and post), `toolpath.py`, `times.py`, `force.py`, ... | the command or group of that name |

Exit codes: 0 done, 1 findings, 2 bad usage or input, 3 a bug of ours, 130 interrupted.
"""

from vmachining.cli.main import main

__all__ = ["main"]
