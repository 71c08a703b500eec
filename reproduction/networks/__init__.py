"""The paper's study of networks: search with a network, attribution, accuracy."""
