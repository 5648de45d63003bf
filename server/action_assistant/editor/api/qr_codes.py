"""Links as QR codes."""

import io

import segno
from litestar import Response


def qr_code(link: str) -> Response[bytes]:
    """Return the answer with a link as a QR code (SVG). It is a secret, so no cache may keep it."""
    out = io.BytesIO()
    drawn = segno.make(link, error="l", micro=False)
    drawn.save(out, kind="svg", scale=8, border=2, light="white", xmldecl=False)
    headers = {"cache-control": "no-store"}
    return Response(out.getvalue(), media_type="image/svg+xml", headers=headers)
