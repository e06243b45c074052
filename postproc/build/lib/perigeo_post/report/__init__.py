"""Put all studies on one page and publish its tables."""
