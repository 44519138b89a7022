"""What an address counts as where there are limits for each."""

from __future__ import annotations

import ipaddress

CUSTOMER_BITS = 64  # of IPv6 addresses: one customer has at least all that begin alike


def counted_as(address: str) -> str:
    """An IPv4 address as it is, also within one of IPv6; an IPv6 address as its /64; anything else as it is."""
    try:
        found = ipaddress.ip_address(address)
    except ValueError:
        return address
    if found.version == 4:
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    return str(ipaddress.IPv6Network((int(found), CUSTOMER_BITS), strict=False))
