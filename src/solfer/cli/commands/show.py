"""Print the effective configuration of a plugin: what is left of all files after merging.

Each line ends with a comment with the file, line and column of its value. The text is YAML, and a main configuration
of its own. Comments at the end list what its component declares: services, topics, actions and parameters.

With --plan it prints instead what each control cycle of the plugin does, in the order in which it does it.
"""

import argparse

from solfer.cli.options import add_file, add_search_paths, add_system


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    add_file(parser)
    parser.add_argument("-n", dest="name", metavar="NAME", required=True, help="plugin configuration to show")
    parser.add_argument(
        "--origin",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="whether each line ends with the place of its value, and declarations are listed",
    )
    parser.add_argument("--plan", action="store_true", help="print the steps of a control cycle instead")
    add_search_paths(parser)
    add_system(parser)


def run(options: argparse.Namespace) -> int:
    """Load and print.

    Raises:
        SolferError: The configuration is wrong.
    """
    from solfer.cli.columns import aligned
    from solfer.cli.plugins import known_declarations
    from solfer.config import load

    configuration = load(options.file, options.name, system=options.system, search_paths=options.search_paths)
    if options.plan:
        from solfer.cli.plan import plan_of

        print(f"{configuration.module.name}, {configuration.rate:g} cycles per second")
        for line in aligned(plan_of(configuration), indent="  "):
            print(line)
        return 0
    print(configuration.text(options.origin), end="")
    if not options.origin:
        return 0
    rows = [("declares", one.kind, one.name, one.interface) for one in known_declarations(configuration)]
    for line in aligned(rows, indent="# "):
        print(line)
    return 0
