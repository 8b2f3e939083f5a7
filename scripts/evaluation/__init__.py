"""Runs the systems of the GraphMatch paper on a collection and compares them."""
