//! stub until the real one lands
