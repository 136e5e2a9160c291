//! What an image file says about itself.

/// One attribute's value, in the types that every OpenEXR reader knows.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// UTF-8 text.
    Text(String),
    /// A whole number.
    Int(i32),
    /// A number.
    Float(f32),
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f32> for Value {
    fn from(number: f32) -> Self {
        Self::Float(number)
    }
}

impl From<u64> for Value {
    /// An [`Value::Int`]; a number too large for it becomes its digits.
    fn from(number: u64) -> Self {
        i32::try_from(number).map_or_else(|_| Self::Text(number.to_string()), Self::Int)
    }
}

/// Names and values, in order. Each name stands once.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes(Vec<(String, Value)>);

impl Attributes {
    /// None.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an attribute at the end, or gives a new value to the one of that name.
    pub fn set(&mut self, name: impl Into<String>, value: impl Into<Value>) {
        let (name, value) = (name.into(), value.into());
        match self.0.iter_mut().find(|(n, _)| *n == name) {
            Some(entry) => entry.1 = value,
            None => self.0.push((name, value)),
        }
    }

    /// The value of a name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.iter().find(|(n, _)| n == name).map(|(_, value)| value)
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_value_of_a_name_takes_the_place_of_the_first() {
        let mut a = Attributes::new();
        a.set("n", 1u64);
        a.set("text", "x");
        a.set("n", 5_000_000_000u64);
        let all: Vec<_> = a.iter().collect();
        assert_eq!(all, [("n", &Value::Text("5000000000".into())), ("text", &Value::Text("x".into()))]);
        assert_eq!(a.get("none"), None);
    }
}
