"""Small changes go through a run from event to event: derivatives, and what rounding does."""
