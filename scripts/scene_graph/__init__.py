"""Matching graphs and image vectors with the statistics of internet photo collections."""
