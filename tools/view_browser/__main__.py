"""`tools/view_check`: see there."""

import argparse
from pathlib import Path

from .check import check, look
from .rate import print_rates


def main() -> None:
    """Reads the arguments."""
    parser = argparse.ArgumentParser(prog="tools/view_check", description=__doc__)
    parser.add_argument("--rate", metavar="SCENE", help="count the images of a scene instead")
    parser.add_argument("--look", nargs=2, metavar=("SCENE", "FOLDER"), help="open the page of a scene instead, use it, and leave pictures in a folder")
    parser.add_argument("--seconds", type=float, default=10.0, help="how long to count")
    parser.add_argument("--pictures", type=Path, help="folder for the pictures of the station, dark and light")
    # Others are options of isotherm, such as --device.
    arguments, more = parser.parse_known_args()
    if arguments.rate:
        print_rates(arguments.rate, arguments.seconds, more)
    elif arguments.look:
        look(arguments.look[0], Path(arguments.look[1]), more)
    else:
        check(arguments.pictures, more)


main()
