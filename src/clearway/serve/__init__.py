"""`clearway serve`: a trained agent as an HTTP and WebSocket service; `client` talks to it and needs httpx alone."""
