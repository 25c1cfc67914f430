"""What a governor is given and answers, and how half-spaces become its constraints."""
