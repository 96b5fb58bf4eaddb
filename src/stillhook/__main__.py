"""The `stillhook` command, also as `python -m stillhook`."""

import sys

from stillhook.base.signals import raised, received, stopped_by


def main() -> None:
    """Entry point of the `stillhook` command: from here on a signal ends it in one line, while it starts too."""
    try:
        with raised():
            from stillhook.cli import main as command

            command()
    except KeyboardInterrupt:
        line, code = stopped_by(received())
        print(line, file=sys.stderr)
        sys.exit(code)


if __name__ == "__main__":
    main()
