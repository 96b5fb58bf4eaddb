"""The `stillhook` command, also as `python -m stillhook`."""

from stillhook.cli import main

if __name__ == "__main__":
    main()
