"""The interface over HTTP and WebSocket, and its access control."""
