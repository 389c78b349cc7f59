"""The paper's equations: numbers moved through time. No TOML, no pydantic, no file."""
