"""A page taken apart: its tags, text, scripts and pictures."""

import base64
import json
from html.parser import HTMLParser
from typing import Any

VOID = {"meta", "link", "br", "img", "source", "hr"}


class Page(HTMLParser):
    """Collects a page's tags, links, text and pictures, and checks that tags are closed."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.scripts: list[str] = []
        self.galleries: list[dict[str, Any]] = []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        self.text += " "

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"]:
            if self.tags[-1][1].get("type") == "application/json":
                self.galleries.append(json.loads(data))
            else:
                self.scripts.append(data)
        elif self.open[-1:] != ["style"]:
            self.text += data + (" " if self.open[-1:] == ["td"] else "")

    def images(self) -> list[bytes]:
        sources = [attributes.get("src") for tag, attributes in self.tags if tag == "img"]
        return [base64.b64decode(str(source).split(",", 1)[1]) for source in sources]


def plain(page: Page) -> str:
    """Give a page's text with single spaces and an ASCII minus."""
    return " ".join(page.text.replace("\N{MINUS SIGN}", "-").split())
