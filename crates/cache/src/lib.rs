//! Order, loss, staleness and blending of received light.
