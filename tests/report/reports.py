"""Reports as the command writes them."""

from snowrepro.report.page import Part, draw, write_page_of


def reported(configs, overrides=()) -> Part:
    """Draw an experiment and write its page; returns what was drawn."""
    part = draw(configs, overrides)
    write_page_of(part)
    return part
