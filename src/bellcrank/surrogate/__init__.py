"""Networks that learn the response from pictures of designs."""
