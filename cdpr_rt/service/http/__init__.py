"""The interface over HTTP and WebSocket, and who may use it."""
