"""Checking missions, whoever wrote them, against a fence: what each leg keeps while drawn and while driven. Knows nothing of planning."""
