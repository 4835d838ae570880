"""Make up trials within the contract, find one in which a package breaks a promise, and shrink it."""
