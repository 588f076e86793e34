"""The interface's description as a page that needs no script and nothing from elsewhere."""

from __future__ import annotations

import re
from html import escape
from typing import Any, Final

from starlette.responses import HTMLResponse

_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'"
_STYLE: Final = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h2 { margin: 2rem 0 .3rem; font-size: 1.1rem; } code, h2 { font-family: ui-monospace, monospace; }
table { border-collapse: collapse; } td, th { padding: .1rem .8rem .1rem 0; text-align: left;
vertical-align: top; } .method { color: #205493; } .about { white-space: pre-line; }
"""


def docs_page(openapi: dict[str, Any]) -> HTMLResponse:
    """Return the page for an OpenAPI description."""
    about = openapi["info"]
    parts = [
        f"<h1>{escape(about['title'])}</h1>",
        f'<p class="about">{_marked(about["description"])}</p>',
        '<p>For programs: <a href="/openapi.json">openapi.json</a>. WebSockets: <code>/live</code> '
        "and <code>/control</code>.</p>",
    ]
    schemas = openapi["components"]["schemas"]
    for path, methods in openapi["paths"].items():
        for method, operation in methods.items():
            parts += _operation(path, method, operation, schemas)
    page = (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        f"<title>{escape(about['title'])}</title><style>{_STYLE}</style>{''.join(parts)}</html>"
    )
    return HTMLResponse(page, headers={"content-security-policy": _POLICY})


def _operation(
    path: str, method: str, operation: dict[str, Any], schemas: dict[str, Any]
) -> list[str]:
    parts = [
        f'<h2><span class="method">{method.upper()}</span> {escape(path)}</h2>',
        f"<p>{_marked(operation.get('description', ''))}</p>",
    ]
    rows = [
        (f"{one['name']} ({one['in']})", one.get("description", ""), one["schema"])
        for one in operation.get("parameters", ())
    ]
    body = operation.get("requestBody", {}).get("content", {}).get("application/json", {})
    for name in _references(body.get("schema", {})):
        for key, schema in schemas[name].get("properties", {}).items():
            rows.append((key, schema.get("description", ""), schema))
    if rows:
        lines = [
            f"<tr><td><code>{escape(name)}</code><td>{escape(_kind(schema))}<td>{escape(text)}"
            for name, text, schema in rows
        ]
        parts.append(f"<table>{''.join(lines)}</table>")
    return parts


def _marked(text: str) -> str:
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


def _references(schema: dict[str, Any]) -> list[str]:
    found = [schema, *schema.get("anyOf", [])]
    return [one["$ref"].rpartition("/")[2] for one in found if "$ref" in one]


def _kind(schema: dict[str, Any]) -> str:
    kind = schema.get("type") or " or ".join(one.get("type", "") for one in schema.get("anyOf", ()))
    default = f", {schema['default']!r} by default" if "default" in schema else ""
    return f"{kind}{default}"
