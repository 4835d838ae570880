"""Small wrong packages, each the reference with a named edit."""
