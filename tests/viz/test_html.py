"""Templates: all are in the package and whole, text is escaped, and what is missing is an error."""

from importlib.resources import files

import jinja2
import pytest

from clearway.viz.html import rendered_html

TEMPLATES = files("clearway.viz") / "templates"
ENDING = ".html.jinja"


def test_the_package_holds_the_templates_and_their_style() -> None:
    names = {file.name for file in TEMPLATES.iterdir()}
    assert {f"{page}{ENDING}" for page in ("demo", "report", "redirect")} | {"style.css"} <= names
    assert all(name.endswith(ENDING) or name == "style.css" for name in names)


def test_text_is_escaped_in_attributes_too() -> None:
    page = rendered_html("redirect", address='http://here/?a=1&b=<2>"><script>')
    assert 'content="0; url=http://here/?a=1&amp;b=&lt;2&gt;&#34;&gt;&lt;script&gt;"' in page


@pytest.mark.parametrize("template", ["demo", "report", "redirect"])
def test_content_that_a_template_misses_is_an_error_and_no_gap(template: str) -> None:
    with pytest.raises(jinja2.UndefinedError, match="is undefined"):
        rendered_html(template)


def test_the_style_goes_into_pages_as_it_is() -> None:
    style = (TEMPLATES / "style.css").read_text(encoding="utf-8")
    page = rendered_html("report", title="", warning="", in_short=(), summary=[], sections=[], facts={})
    assert "> * {" in style and f"<style>\n{style}" in page
