"""Parts that several figures or pages share."""
