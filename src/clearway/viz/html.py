"""HTML from the Jinja2 templates that lie in `viz/templates`. Jinja2 is imported on first use."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def rendered_html(template: str, **content: Any) -> str:
    """A template filled in; all text of `content` is escaped.

    Args:
        template: its file name, without the ending ".html.jinja".
        content: what the template names.

    Raises:
        jinja2.UndefinedError: the template names something that `content` does not have.
    """
    return _templates().get_template(f"{template}.html.jinja").render(content)


@cache
def _templates() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("clearway.viz"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
