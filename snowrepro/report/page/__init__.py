"""Pages: sections put together as HTML, Markdown and JSON."""
