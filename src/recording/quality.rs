//! What a recording can show.
