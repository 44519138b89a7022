"""Files in object stores and on web servers: their addresses, the way to them, and a cache of them on this machine.

`cache.fetched` is what others use: addresses in, files on this machine out; `passing` has files come again that went.
"""
