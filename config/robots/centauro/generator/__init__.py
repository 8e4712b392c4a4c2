"""Writers of CENTAURO's files, used by generate.py."""
