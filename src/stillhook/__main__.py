"""The `stillhook` command, also as `python -m stillhook`."""

import sys

from stillhook.errors import StillhookError


def main() -> None:
    """Run the command line; a module of the user that cannot be loaded is reported in one line, with exit code 2."""
    try:
        from stillhook.cli import main as run  # loads the winch types and controllers, those of the user as well
    except StillhookError as problem:
        print(f"error: {problem}", file=sys.stderr)  # noqa: T201
        sys.exit(2)
    run()


if __name__ == "__main__":
    main()
