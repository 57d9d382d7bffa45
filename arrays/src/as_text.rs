//! Serde and JSON schema for the types that files and users write as one text.

/// Serialise a type as its `Display` text, deserialise it by `FromStr`, and describe that text in a JSON schema (feature `schema`).
///
/// The description and the examples may be any expressions that give a `String` and an array of `&str`.
macro_rules! as_text {
    ($name:ident, $description:expr, $examples:expr) => {
        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_str(self)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = String::deserialize(deserializer)?;
                text.parse().map_err(serde::de::Error::custom)
            }
        }

        #[cfg(feature = "schema")]
        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($name).into()
            }

            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let description: String = $description;
                schemars::json_schema!({"type": "string", "description": description, "examples": $examples})
            }
        }
    };
}

pub(crate) use as_text;
