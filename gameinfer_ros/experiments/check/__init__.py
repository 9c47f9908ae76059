"""The check of equilibria: whether any player could do better by itself."""
