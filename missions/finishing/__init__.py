"""A found route made a plan: rounded to degE7, measured again as it will be drawn and driven, written as mission items."""
