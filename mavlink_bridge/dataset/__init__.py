"""Thousands of logs as one dataset: Parquet files that any tool reads, ready questions, and a rover's own bounds.

The only room that knows DuckDB; it needs the extra ``data``.
"""
