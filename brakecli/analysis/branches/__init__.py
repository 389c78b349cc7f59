"""Motions followed through a parameter by an engine that knows no brakes, and where they change."""
