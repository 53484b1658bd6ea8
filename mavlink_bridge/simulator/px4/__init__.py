"""A rover that answers like PX4: transfers, messages and modes as measured on v1.17.0 and the line of 1.18. How it drives is not PX4's yet."""
