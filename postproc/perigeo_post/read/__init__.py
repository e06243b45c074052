"""Read what perigeo writes: result files, their frames and fields, and the history."""
