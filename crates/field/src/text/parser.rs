//! Formulas: a parser by binding strength.

use rustc_hash::FxHashMap;

use super::lexer::{Token, error_at, is_identifier, short, tokens};
use super::suggestion;
use crate::FieldError;
use crate::arrange::Arrange;
use crate::model::{Category, Model, PayloadKind, Value, kind, kinds};

/// Longest text in bytes.
pub const MAX_TEXT: usize = 1 << 20;
/// Deepest nesting of brackets, signs and powers.
pub const MAX_NESTING: usize = 200;

const CONSTANTS: [(&str, f64); 3] =
    [("pi", std::f64::consts::PI), ("e", std::f64::consts::E), ("tau", std::f64::consts::TAU)];

/// How a text is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Number of coordinates: 3, or 2 for a curve in the plane z = 0.
    pub axes: usize,
    /// Whether the text is h(f, g) of a blend: its coordinates are called f and g.
    pub blend: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { axes: 3, blend: false }
    }
}

/// Reads a formula such as `x^2 + y^2 + z^2 - r^2` or `sphere(r=1) | box(2, 1, 1)`, with the values of its named
/// parameters.
///
/// From weakest to strongest: `<` `>` `<=` `>=` (1 or 0); `|` union; `&` intersection; `+` `-`; `*` `/` `%`; unary
/// `-` `+` `~` (complement); `^` or `**`, from the right. Between two solids (shapes, set operations, blends,
/// deformations) `-` is the difference, otherwise subtraction; `sub(a, b)` always subtracts. Every kind of the
/// table is a function: operands first, then parameters in order or by keyword; a parameter may be any
/// expression. `name = expression;` before the formula names a part, which may then occur several times and has
/// its parameters once. `#` begins a comment. Constants: pi, e, tau.
///
/// Errors carry the position. Texts beyond [`MAX_TEXT`] or [`MAX_NESTING`] are refused.
pub fn parse(text: &str, parameters: &[(&str, f64)]) -> Result<Model, FieldError> {
    parse_with(text, parameters, Options::default())
}

/// [`parse`] with options.
pub fn parse_with(text: &str, parameters: &[(&str, f64)], options: Options) -> Result<Model, FieldError> {
    if text.len() > MAX_TEXT {
        let n = text.len();
        return Err(FieldError::TooLarge(format!("a formula may have {MAX_TEXT} bytes, this one has {n}")));
    }
    if !(2..=3).contains(&options.axes) {
        return Err(FieldError::Invalid(format!("axes must be 2 or 3, given {}", options.axes)));
    }
    let mut given = FxHashMap::default();
    for &(name, value) in parameters {
        if !is_identifier(name) || ["x", "y", "z"].contains(&name) {
            return Err(FieldError::Invalid(format!(
                "`{name}` cannot be a parameter: give a name of letters, digits and _, other than x, y and z"
            )));
        }
        if given.insert(name.to_string(), (Model::parameter(name, value)?, false)).is_some() {
            return Err(FieldError::Invalid(format!("the parameter `{name}` is given twice")));
        }
    }
    let mut parser = Parser {
        text,
        tokens: tokens(text)?,
        next: 0,
        nesting: 0,
        in_blend: options.blend,
        axes: options.axes,
        coordinates: [0, 1, 2].map(Model::axis),
        bindings: FxHashMap::default(),
        parameters: given,
    };
    let model = parser.whole()?;
    let mut unused: Vec<&str> =
        parser.parameters.iter().filter(|(_, (_, used))| !used).map(|(name, _)| name.as_str()).collect();
    unused.arrange();
    if let Some(name) = unused.first() {
        return Err(FieldError::Invalid(format!(
            "the parameter `{name}` is given a value but does not occur in the formula"
        )));
    }
    if options.axes == 2 { Model::call("planar", vec![Value::Model(model)], vec![]) } else { Ok(model) }
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(Token<'a>, usize)>,
    next: usize,
    nesting: usize,
    in_blend: bool,
    axes: usize,
    coordinates: [Model; 3],
    bindings: FxHashMap<String, Model>,
    parameters: FxHashMap<String, (Model, bool)>,
}

/// Operands of one sign in a row, `a + b + c`, which become one node.
enum Chain {
    One(Model),
    Many(&'static str, Vec<Model>),
}

impl Chain {
    fn push(self, kind: &'static str, right: Model) -> Result<Self, FieldError> {
        match self {
            Chain::Many(k, mut all) if k == kind => {
                all.push(right);
                Ok(Chain::Many(k, all))
            }
            left => Ok(Chain::Many(kind, vec![left.into_model()?, right])),
        }
    }

    fn is_solid(&self) -> bool {
        match self {
            Chain::One(m) => m.is_solid(),
            Chain::Many(k, _) => kind(k).is_some_and(|k| k.is_solid()),
        }
    }

    fn into_model(self) -> Result<Model, FieldError> {
        match self {
            Chain::One(m) => Ok(m),
            Chain::Many(k, all) => node(k, all),
        }
    }
}

fn node(name: &str, operands: Vec<Model>) -> Result<Model, FieldError> {
    Model::call(name, operands.into_iter().map(Value::Model).collect(), vec![])
}

/// The strength of a sign between two operands.
fn strength(sign: &str) -> Option<u8> {
    Some(match sign {
        "<" | ">" | "<=" | ">=" => 0,
        "|" => 1,
        "&" => 2,
        "+" | "-" => 3,
        "*" | "/" | "%" => 4,
        _ => return None,
    })
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Token<'a> {
        self.tokens[self.next].0
    }

    fn peek_second(&self) -> Token<'a> {
        self.tokens.get(self.next + 1).map_or(Token::End, |t| t.0)
    }

    fn position(&self) -> usize {
        self.tokens[self.next].1
    }

    fn advance(&mut self) -> Token<'a> {
        let t = self.peek();
        if t != Token::End {
            self.next += 1;
        }
        t
    }

    fn accept(&mut self, sign: &'static str) -> bool {
        let found = self.peek() == Token::Sign(sign);
        if found {
            self.next += 1;
        }
        found
    }

    fn fail<T>(&self, reason: impl Into<String>) -> Result<T, FieldError> {
        Err(error_at(self.text, self.position(), reason))
    }

    /// Gives an error without a position that of byte `at`.
    fn place<T>(&self, at: usize, result: Result<T, FieldError>) -> Result<T, FieldError> {
        result.map_err(|e| match e {
            FieldError::Invalid(reason) => error_at(self.text, at, reason),
            other => other,
        })
    }

    fn nested<T>(&mut self, step: impl FnOnce(&mut Self) -> Result<T, FieldError>) -> Result<T, FieldError> {
        if self.nesting == MAX_NESTING {
            return self
                .fail(format!("nested more than {MAX_NESTING} deep; name parts: `a = …; b = … a …; b`"));
        }
        self.nesting += 1;
        let result = step(self);
        self.nesting -= 1;
        result
    }

    fn whole(&mut self) -> Result<Model, FieldError> {
        while let (Token::Name(name), Token::Sign("=")) = (self.peek(), self.peek_second()) {
            if ["x", "y", "z"].contains(&name) || self.parameters.contains_key(name) {
                return self.fail(format!("`{name}` already means something else"));
            }
            if self.bindings.contains_key(name) {
                return self.fail(format!("`{name}` is defined twice"));
            }
            let at = self.position();
            self.next += 2;
            let first = self.next;
            let mut part = self.expression(0)?;
            let is_alias = self.next == first + 1 && matches!(self.tokens[first].0, Token::Name(_));
            if !name.starts_with('_') && !is_alias && part.kind().category != Category::Atom {
                part = self.place(at, part.named(name))?;
            }
            self.bindings.insert(name.to_string(), part);
            if !self.accept(";") {
                return self
                    .fail(format!("expected `;` after the definition of `{name}`, found {}", self.peek()));
            }
        }
        let model = self.expression(0)?;
        match self.peek() {
            Token::End => Ok(model),
            t @ (Token::Name(_) | Token::Number(_) | Token::Sign("(")) => {
                self.fail(format!("expected a sign such as + or * before {t}"))
            }
            Token::Sign(")") => self.fail("this bracket closes none"),
            Token::Sign("=" | "==") => {
                self.fail("a surface is F = 0: write the left side minus the right side")
            }
            t => self.fail(format!("expected the end of the formula, found {t}")),
        }
    }

    /// An expression of signs of at least this strength.
    fn expression(&mut self, weakest: u8) -> Result<Model, FieldError> {
        let mut left = Chain::One(self.prefixed()?);
        while let Token::Sign(sign) = self.peek() {
            let Some(level) = strength(sign).filter(|s| *s >= weakest) else { break };
            let at = self.position();
            self.next += 1;
            let right = self.expression(level + 1)?;
            let joined = join(left, sign, right);
            left = self.place(at, joined)?;
            if level == 0 && matches!(self.peek(), Token::Sign("<" | ">" | "<=" | ">=")) {
                return self.fail("comparisons cannot be chained; write (a < b)*(b < c)");
            }
        }
        let at = self.position();
        let model = left.into_model();
        self.place(at, model)
    }

    /// Signs before an operand, and powers.
    fn prefixed(&mut self) -> Result<Model, FieldError> {
        let at = self.position();
        match self.peek() {
            Token::Sign(sign @ ("-" | "+" | "~")) => {
                self.next += 1;
                let literal = matches!(self.peek(), Token::Number(_)).then_some(self.next + 1);
                let operand = self.nested(Self::prefixed)?;
                let is_literal = literal == Some(self.next);
                let result = match (sign, operand.as_constant()) {
                    ("+", _) => Ok(operand),
                    ("-", Some(v)) if is_literal => Model::constant(-v),
                    ("-", _) => node("neg", vec![operand]),
                    _ => node("complement", vec![operand]),
                };
                self.place(at, result)
            }
            _ => {
                let base = self.atom()?;
                let at = self.position();
                if !self.accept("^") && !self.accept("**") {
                    return Ok(base);
                }
                let exponent = self.nested(Self::prefixed)?;
                let result = node("pow", vec![base, exponent]);
                self.place(at, result)
            }
        }
    }

    fn atom(&mut self) -> Result<Model, FieldError> {
        let at = self.position();
        match self.advance() {
            Token::Number(v) => Model::constant(v),
            Token::Name(name) if self.peek() == Token::Sign("(") => self.call(name, at),
            Token::Name(name) => {
                let found = self.lookup(name);
                self.place(at, found)
            }
            Token::Sign("(") => {
                let inner = self.nested(|p| p.expression(0))?;
                if self.accept(")") {
                    return Ok(inner);
                }
                let line = self.text[..at].chars().count();
                self.fail(format!("expected `)` for the bracket at position {line}, found {}", self.peek()))
            }
            other => {
                Err(error_at(self.text, at, format!("expected a number, a name or a bracket, found {other}")))
            }
        }
    }

    fn lookup(&mut self, name: &str) -> Result<Model, FieldError> {
        let value = ["f", "g"].iter().position(|n| *n == name);
        if let (true, Some(axis)) = (self.in_blend, value) {
            return Ok(self.coordinates[axis].clone());
        }
        if let Some(m) = self.bindings.get(name) {
            return Ok(m.clone());
        }
        if let Some((m, used)) = self.parameters.get_mut(name) {
            *used = true;
            return Ok(m.clone());
        }
        if let Some(axis) = ["x", "y", "z"].iter().position(|n| *n == name) {
            if self.in_blend {
                return Err(FieldError::Invalid(format!(
                    "h knows only f and g, the values of the operands, not `{name}`"
                )));
            }
            if axis >= self.axes {
                return Err(FieldError::Invalid("a curve in the plane has no z".into()));
            }
            return Ok(self.coordinates[axis].clone());
        }
        if let Some((_, v)) = CONSTANTS.iter().find(|(n, _)| *n == name) {
            return Model::constant(*v);
        }
        if let Some(k) = kind(name) {
            return Err(FieldError::Invalid(format!("`{name}` is a function: write {}(…)", k.name)));
        }
        let names = self.bindings.keys().chain(self.parameters.keys()).map(String::as_str);
        let known = names.chain(["x", "y", "z"]).chain(CONSTANTS.iter().map(|c| c.0));
        let hint = suggestion(name, known);
        let name = short(name);
        Err(FieldError::Invalid(if hint.is_empty() {
            format!("unknown name `{name}`; if it is a parameter, give its value: {name}=1")
        } else {
            format!("unknown name `{name}`{hint}")
        }))
    }

    /// The arguments of a call; the next sign is its bracket.
    fn call(&mut self, name: &'a str, at: usize) -> Result<Model, FieldError> {
        let Some(k) = kind(name) else {
            let known = kinds().iter().filter(|k| k.category != Category::Atom).map(|k| k.name);
            let shown = short(name);
            let mut reason = format!("there is no shape or function `{shown}`{}", suggestion(name, known));
            if self.parameters.contains_key(name) || self.bindings.contains_key(name) || name.len() == 1 {
                reason.push_str(&format!("; to multiply write {name}*(…)"));
            }
            return Err(error_at(self.text, at, reason));
        };
        if k.category == Category::Atom {
            return Err(error_at(
                self.text,
                at,
                format!("`{name}` is no function; to multiply write {name}*(…)"),
            ));
        }
        self.next += 1;
        let (mut positional, mut keyword, mut places) = (Vec::new(), Vec::new(), Vec::new());
        while !self.accept(")") {
            places.push(self.position());
            let mut key = None;
            if let (Token::Name(n), Token::Sign("=")) = (self.peek(), self.peek_second()) {
                key = Some(n);
                self.next += 2;
            } else if !keyword.is_empty() {
                return self.fail("arguments in order must stand before those by name");
            }
            let operands = match k.operands {
                crate::model::Operands::Exactly(n) => n,
                crate::model::Operands::AtLeast(_) => usize::MAX,
            };
            let is_h = k.payload == PayloadKind::Expression
                && key.map_or(positional.len() == operands, |key| key == "h");
            let outer = self.in_blend;
            self.in_blend |= is_h;
            let value = self.nested(|p| p.expression(0))?;
            self.in_blend = outer;
            match key {
                Some(key) => keyword.push((key.to_string(), Value::Model(value))),
                None => positional.push(Value::Model(value)),
            }
            if !self.accept(",") && self.peek() != Token::Sign(")") {
                let found = self.peek();
                return self.fail(format!("expected `,` or `)` in the arguments of `{name}`, found {found}"));
            }
        }
        Model::call_located(k.name, positional, keyword).map_err(|e| {
            error_at(self.text, e.argument.and_then(|i| places.get(i).copied()).unwrap_or(at), e.reason)
        })
    }
}

fn join(left: Chain, sign: &str, right: Model) -> Result<Chain, FieldError> {
    let kind = match sign {
        "+" => return left.push("add", right),
        "*" => return left.push("mul", right),
        "|" => return left.push("union", right),
        "&" => return left.push("intersection", right),
        "-" if left.is_solid() && right.is_solid() => return left.push("difference", right),
        "-" => "sub",
        "/" => "div",
        "%" => "mod",
        "<" | ">=" => "less",
        _ => return Ok(Chain::One(compared(right, left.into_model()?, sign)?)),
    };
    Ok(Chain::One(match sign {
        ">=" => compared(left.into_model()?, right, sign)?,
        _ => node(kind, vec![left.into_model()?, right])?,
    }))
}

/// a < b, or where the sign admits equality 1 − (a < b) with the operands as given.
fn compared(a: Model, b: Model, sign: &str) -> Result<Model, FieldError> {
    let less = node("less", vec![a, b])?;
    if sign.len() == 1 { Ok(less) } else { node("sub", vec![Model::constant(1.0)?, less]) }
}

impl Model {
    /// What a sign of the text syntax means between two models: `+ - * / % ^ | & <`. Chains of `+ * | &` and of
    /// differences become one node.
    pub fn operator(&self, sign: &str, right: &Model) -> Result<Model, FieldError> {
        if sign == "^" || sign == "**" {
            return node("pow", vec![self.clone(), right.clone()]);
        }
        if strength(sign).is_none() {
            return Err(FieldError::Invalid(format!(
                "there is no operator `{sign}`; there are + - * / % ^ | & <"
            )));
        }
        let chained = match self.kind().name {
            k @ ("add" | "mul" | "union" | "intersection" | "difference")
                if self.name().is_none() && self.params().is_empty() =>
            {
                Chain::Many(k, self.operands().to_vec())
            }
            _ => Chain::One(self.clone()),
        };
        join(chained, sign, right.clone())?.into_model()
    }
}
