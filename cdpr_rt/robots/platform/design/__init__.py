"""How a platform's loop is designed: plant, margins in frequency, a cycle in time, gains."""
