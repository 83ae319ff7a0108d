"""Contacts that persist: which ones do, and how balls move that press on each other."""
