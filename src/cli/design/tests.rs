//! Tests of the designer without a browser.
