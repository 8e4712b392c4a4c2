"""Print what makes a shell complete `solfer`: commands, options, configurations, robots, plugins and files.

`eval "$(solfer completion)"` turns it on in bash; in ~/.bashrc, behind the line that sources the workspace, in all.
"""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("--shell", choices=("bash", "zsh", "fish"), default="bash", help="default: %(default)s")


def run(options: argparse.Namespace) -> int:
    """Print the script."""
    from argcomplete import shellcode

    print(shellcode(["solfer"], shell=options.shell))
    return 0
