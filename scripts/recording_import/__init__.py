"""Recordings of others, read from their files and written as a bag."""
