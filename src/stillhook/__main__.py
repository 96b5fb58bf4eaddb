"""`python -m stillhook`: the command line, where the command itself is not on the path."""

from stillhook.cli import main

if __name__ == "__main__":
    main()
