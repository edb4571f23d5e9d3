"""The scenarios that Trundle ships: the clearance paper's, as far as it describes them."""
