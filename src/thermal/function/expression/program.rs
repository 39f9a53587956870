//! The operations that naga made of an expression's text, in order, evaluated with their derivatives.

use std::collections::HashMap;

use naga::front::glsl;
use naga::{Handle, MathFunction};

use super::MAX_OPERATIONS;
use super::dual::{Dual, Unary};

/// Name of the GLSL function whose body the text is.
const FUNCTION: &str = "isotherm_share_done";
/// Longest text; nothing that is a formula comes near.
const MAX_TEXT: usize = 2000;

/// Place of a number that an operation leaves.
pub(super) type Slot = usize;

/// What leaves a number in a slot.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Operation {
    Constant(f64),
    Argument,
    Load(usize),
    Call(Unary, Slot),
    Negate(Slot),
    Not(Slot),
    Binary(Binary, Slot, Slot),
    Clamp(Slot, Slot, Slot),
    Mix(Slot, Slot, Slot),
    SmoothStep(Slot, Slot, Slot),
    MultiplyAdd(Slot, Slot, Slot),
    Select(Slot, Slot, Slot),
    Same(Slot),
}

/// Operations on two numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    And,
    Or,
    Pow,
    Min,
    Max,
    Step,
    Atan2,
}

/// A step of a program.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Statement {
    Set(Slot, Operation),
    Store(usize, Slot),
    If(Slot, Vec<Statement>, Vec<Statement>),
    Return(Slot),
}

/// A compiled expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    pub(super) body: Vec<Statement>,
    pub(super) slots: usize,
    pub(super) locals: usize,
    operations: usize,
}

impl Program {
    /// Compiles GLSL text of `s`.
    ///
    /// # Errors
    /// What naga says, or what the text does beyond arithmetic.
    pub fn compile(text: &str) -> Result<Self, String> {
        check_text(text)?;
        // On a line of its own, so that naga's messages show the text and nothing of ours.
        Self::compile_body(&format!("return float(\n{text}\n);"))
    }

    /// Compiles the statements of a GLSL function of `s`.
    pub(super) fn compile_body(body: &str) -> Result<Self, String> {
        let source = format!("#version 450\nfloat {FUNCTION}(float s) {{ {body} }}\nvoid main() {{}}\n");
        let options = glsl::Options::from(naga::ShaderStage::Compute);
        let module = glsl::Frontend::default().parse(&options, &source).map_err(|errors| {
            let messages: Vec<String> = errors.errors.iter().map(|error| error.kind.to_string()).collect();
            format!("is not GLSL: {}", messages.join("; "))
        })?;
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .map_err(|error| format!("is not valid GLSL: {}", error.into_inner()))?;
        let function = module.functions.iter().find(|(_, function)| function.name.as_deref() == Some(FUNCTION));
        let (_, function) = function.ok_or("leaves no function of s")?;
        Reader { module: &module, function, slots: HashMap::new(), locals: HashMap::new(), operations: 0 }.program()
    }

    /// Number of operations, constants not counted.
    pub fn operations(&self) -> usize {
        self.operations
    }

    /// Value and derivative at s.
    pub fn run(&self, s: f64) -> Dual {
        let mut slots = vec![Dual::constant(0.0); self.slots];
        let mut locals = vec![Dual::constant(0.0); self.locals];
        let argument = Dual { value: s, rate: 1.0 };
        run(&self.body, argument, &mut slots, &mut locals).unwrap_or(Dual::constant(f64::NAN))
    }
}

fn run(body: &[Statement], s: Dual, slots: &mut [Dual], locals: &mut [Dual]) -> Option<Dual> {
    for statement in body {
        match statement {
            Statement::Set(slot, operation) => slots[*slot] = evaluate(operation, s, slots, locals),
            Statement::Store(local, slot) => locals[*local] = slots[*slot],
            Statement::If(condition, accept, reject) => {
                let taken = if slots[*condition].is_true() { accept } else { reject };
                if let Some(value) = run(taken, s, slots, locals) {
                    return Some(value);
                }
            }
            Statement::Return(slot) => return Some(slots[*slot]),
        }
    }
    None
}

fn evaluate(operation: &Operation, s: Dual, slots: &[Dual], locals: &[Dual]) -> Dual {
    match *operation {
        Operation::Constant(value) => Dual::constant(value),
        Operation::Argument => s,
        Operation::Load(local) => locals[local],
        Operation::Call(name, x) => slots[x].call(name),
        Operation::Negate(x) => -slots[x],
        Operation::Not(x) => Dual::truth(!slots[x].is_true()),
        Operation::Clamp(x, low, high) => slots[x].max(slots[low]).min(slots[high]),
        Operation::Mix(x, y, share) => slots[x].mix(slots[y], slots[share]),
        Operation::SmoothStep(low, high, x) => Dual::smoothstep(slots[low], slots[high], slots[x]),
        Operation::MultiplyAdd(x, y, z) => slots[x] * slots[y] + slots[z],
        Operation::Select(condition, accept, reject) => slots[if slots[condition].is_true() { accept } else { reject }],
        Operation::Same(x) => slots[x],
        Operation::Binary(name, x, y) => {
            let (x, y) = (slots[x], slots[y]);
            match name {
                Binary::Add => x + y,
                Binary::Subtract => x - y,
                Binary::Multiply => x * y,
                Binary::Divide => x / y,
                Binary::Remainder => x.remainder(y),
                Binary::Equal => Dual::truth(x.value == y.value),
                Binary::NotEqual => Dual::truth(x.value != y.value),
                Binary::Less => Dual::truth(x.value < y.value),
                Binary::LessEqual => Dual::truth(x.value <= y.value),
                Binary::And => Dual::truth(x.is_true() && y.is_true()),
                Binary::Or => Dual::truth(x.is_true() || y.is_true()),
                Binary::Pow => x.pow(y),
                Binary::Min => x.min(y),
                Binary::Max => x.max(y),
                Binary::Step => Dual::step(x, y),
                Binary::Atan2 => x.atan2(y),
            }
        }
    }
}

/// Refuses what would leave the one expression that the text must be.
fn check_text(text: &str) -> Result<(), String> {
    if text.is_empty() {
        return Err("is empty: write GLSL of s, such as s*s*(3.0-2.0*s)".to_owned());
    }
    if text.len() > MAX_TEXT {
        return Err(format!("has {} characters; at most {MAX_TEXT} are taken", text.len()));
    }
    let allowed = |c: char| c.is_ascii_alphanumeric() || "_+-*/%(),.?:<>=!&| \t\n".contains(c);
    if let Some(c) = text.chars().find(|c| !allowed(*c)) {
        return Err(format!("'{c}' has no place in an expression of s"));
    }
    let comments = ["//", "/*"].iter().any(|comment| text.contains(comment));
    let mut depth = 0;
    for c in text.chars() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        if depth < 0 {
            break;
        }
    }
    if comments || depth != 0 {
        return Err(if comments { "must not hold comments" } else { "has unbalanced parentheses" }.to_owned());
    }
    Ok(())
}

/// Turns naga's function into a program.
struct Reader<'a> {
    module: &'a naga::Module,
    function: &'a naga::Function,
    slots: HashMap<Handle<naga::Expression>, Slot>,
    locals: HashMap<Handle<naga::LocalVariable>, usize>,
    operations: usize,
}

impl Reader<'_> {
    fn program(mut self) -> Result<Program, String> {
        let mut body = Vec::new();
        // Expressions that no statement emits: constants, arguments, variables.
        for (handle, expression) in self.function.expressions.iter() {
            if expression.needs_pre_emit() {
                self.set(handle, &mut body)?;
            }
        }
        for (handle, local) in self.function.local_variables.iter() {
            let number = self.locals.len();
            self.locals.insert(handle, number);
            if let Some(init) = local.init {
                let slot = self.slot(init)?;
                body.push(Statement::Store(number, slot));
            }
        }
        self.block(&self.function.body, &mut body)?;
        if self.operations > MAX_OPERATIONS {
            return Err(format!("comes to {} operations; at most {MAX_OPERATIONS} are taken", self.operations));
        }
        let slots = self.slots.len();
        Ok(Program { body, slots, locals: self.locals.len(), operations: self.operations })
    }

    fn block(&mut self, block: &naga::Block, out: &mut Vec<Statement>) -> Result<(), String> {
        for statement in block {
            match statement {
                naga::Statement::Emit(range) => {
                    for handle in range.clone() {
                        self.set(handle, out)?;
                    }
                }
                naga::Statement::Block(inner) => self.block(inner, out)?,
                naga::Statement::If { condition, accept, reject } => {
                    let condition = self.slot(*condition)?;
                    let (mut yes, mut no) = (Vec::new(), Vec::new());
                    self.block(accept, &mut yes)?;
                    self.block(reject, &mut no)?;
                    out.push(Statement::If(condition, yes, no));
                }
                naga::Statement::Store { pointer, value } => {
                    let local = self.local(*pointer)?;
                    out.push(Statement::Store(local, self.slot(*value)?));
                }
                naga::Statement::Return { value: Some(value) } => out.push(Statement::Return(self.slot(*value)?)),
                naga::Statement::Return { value: None } => {}
                _ => return Err("does more than to compute a number from s".to_owned()),
            }
        }
        Ok(())
    }

    fn local(&self, pointer: Handle<naga::Expression>) -> Result<usize, String> {
        match self.function.expressions[pointer] {
            naga::Expression::LocalVariable(local) => {
                self.locals.get(&local).copied().ok_or_else(|| "uses a variable out of turn".to_owned())
            }
            _ => Err("may read nothing but s".to_owned()),
        }
    }

    fn slot(&self, handle: Handle<naga::Expression>) -> Result<Slot, String> {
        self.slots.get(&handle).copied().ok_or_else(|| "may use single numbers only, no vectors".to_owned())
    }

    fn set(&mut self, handle: Handle<naga::Expression>, out: &mut Vec<Statement>) -> Result<(), String> {
        let expression = &self.function.expressions[handle];
        // Pointers are no numbers; whoever stores or loads looks at the variable itself.
        if matches!(expression, naga::Expression::LocalVariable(_)) {
            return Ok(());
        }
        let operation = self.operation(expression)?;
        let free =
            matches!(operation, Operation::Constant(_) | Operation::Argument | Operation::Load(_) | Operation::Same(_));
        self.operations += usize::from(!free);
        let slot = self.slots.len();
        self.slots.insert(handle, slot);
        out.push(Statement::Set(slot, operation));
        Ok(())
    }

    fn operation(&self, expression: &naga::Expression) -> Result<Operation, String> {
        use naga::Expression as E;
        Ok(match *expression {
            E::Literal(literal) => Operation::Constant(number(literal)?),
            E::Constant(constant) => {
                let init = self.module.constants[constant].init;
                match self.module.global_expressions[init] {
                    E::Literal(literal) => Operation::Constant(number(literal)?),
                    _ => return Err("may use single numbers only, no vectors".to_owned()),
                }
            }
            E::FunctionArgument(_) => Operation::Argument,
            E::Load { pointer } => Operation::Load(self.local(pointer)?),
            E::Unary { op: naga::UnaryOperator::Negate, expr } => Operation::Negate(self.slot(expr)?),
            E::Unary { op: naga::UnaryOperator::LogicalNot, expr } => Operation::Not(self.slot(expr)?),
            E::Binary { op, left, right } => self.binary(op, self.slot(left)?, self.slot(right)?)?,
            E::Select { condition, accept, reject } => {
                Operation::Select(self.slot(condition)?, self.slot(accept)?, self.slot(reject)?)
            }
            E::Math { fun, arg, arg1, arg2, .. } => self.math(fun, arg, arg1, arg2)?,
            E::As { expr, kind: naga::ScalarKind::Float, .. } => Operation::Same(self.slot(expr)?),
            E::GlobalVariable(_) => return Err("may read nothing but s".to_owned()),
            E::Compose { .. } | E::Splat { .. } | E::Swizzle { .. } | E::Access { .. } | E::AccessIndex { .. } => {
                return Err("may use single numbers only, no vectors".to_owned());
            }
            _ => return Err("uses what is no arithmetic of s".to_owned()),
        })
    }

    fn binary(&self, op: naga::BinaryOperator, x: Slot, y: Slot) -> Result<Operation, String> {
        use naga::BinaryOperator as B;
        let (name, x, y) = match op {
            B::Add => (Binary::Add, x, y),
            B::Subtract => (Binary::Subtract, x, y),
            B::Multiply => (Binary::Multiply, x, y),
            B::Divide => (Binary::Divide, x, y),
            B::Modulo => (Binary::Remainder, x, y),
            B::Equal => (Binary::Equal, x, y),
            B::NotEqual => (Binary::NotEqual, x, y),
            B::Less => (Binary::Less, x, y),
            B::LessEqual => (Binary::LessEqual, x, y),
            B::Greater => (Binary::Less, y, x),
            B::GreaterEqual => (Binary::LessEqual, y, x),
            B::LogicalAnd => (Binary::And, x, y),
            B::LogicalOr => (Binary::Or, x, y),
            _ => return Err("uses bit operations".to_owned()),
        };
        Ok(Operation::Binary(name, x, y))
    }

    fn math(
        &self,
        fun: MathFunction,
        arg: Handle<naga::Expression>,
        arg1: Option<Handle<naga::Expression>>,
        arg2: Option<Handle<naga::Expression>>,
    ) -> Result<Operation, String> {
        let x = self.slot(arg)?;
        let wrong = || format!("calls {fun:?}, which is no function of single numbers");
        if let Some(unary) = unary(fun) {
            return Ok(Operation::Call(unary, x));
        }
        let y = self.slot(arg1.ok_or_else(wrong)?)?;
        let name = match fun {
            MathFunction::Pow => Some(Binary::Pow),
            MathFunction::Min => Some(Binary::Min),
            MathFunction::Max => Some(Binary::Max),
            MathFunction::Step => Some(Binary::Step),
            MathFunction::Atan2 => Some(Binary::Atan2),
            _ => None,
        };
        if let Some(name) = name {
            return Ok(Operation::Binary(name, x, y));
        }
        let z = self.slot(arg2.ok_or_else(wrong)?)?;
        match fun {
            MathFunction::Clamp => Ok(Operation::Clamp(x, y, z)),
            MathFunction::Mix => Ok(Operation::Mix(x, y, z)),
            MathFunction::SmoothStep => Ok(Operation::SmoothStep(x, y, z)),
            MathFunction::Fma => Ok(Operation::MultiplyAdd(x, y, z)),
            _ => Err(wrong()),
        }
    }
}

fn unary(fun: MathFunction) -> Option<Unary> {
    Some(match fun {
        MathFunction::Abs => Unary::Abs,
        MathFunction::Sign => Unary::Sign,
        MathFunction::Floor => Unary::Floor,
        MathFunction::Ceil => Unary::Ceil,
        MathFunction::Round => Unary::Round,
        MathFunction::Trunc => Unary::Trunc,
        MathFunction::Fract => Unary::Fract,
        MathFunction::Saturate => Unary::Saturate,
        MathFunction::Radians => Unary::Radians,
        MathFunction::Degrees => Unary::Degrees,
        MathFunction::Sin => Unary::Sin,
        MathFunction::Cos => Unary::Cos,
        MathFunction::Tan => Unary::Tan,
        MathFunction::Asin => Unary::Asin,
        MathFunction::Acos => Unary::Acos,
        MathFunction::Atan => Unary::Atan,
        MathFunction::Sinh => Unary::Sinh,
        MathFunction::Cosh => Unary::Cosh,
        MathFunction::Tanh => Unary::Tanh,
        MathFunction::Asinh => Unary::Asinh,
        MathFunction::Acosh => Unary::Acosh,
        MathFunction::Atanh => Unary::Atanh,
        MathFunction::Exp => Unary::Exp,
        MathFunction::Exp2 => Unary::Exp2,
        MathFunction::Log => Unary::Log,
        MathFunction::Log2 => Unary::Log2,
        MathFunction::Sqrt => Unary::Sqrt,
        MathFunction::InverseSqrt => Unary::InverseSqrt,
        _ => return None,
    })
}

/// A literal as the text wrote it: the shortest decimal of the f32 that naga keeps.
fn number(literal: naga::Literal) -> Result<f64, String> {
    match literal {
        naga::Literal::F32(value) => Ok(value.to_string().parse().unwrap_or(f64::from(value))),
        naga::Literal::F64(value) | naga::Literal::AbstractFloat(value) => Ok(value),
        naga::Literal::I32(value) => Ok(f64::from(value)),
        naga::Literal::U32(value) => Ok(f64::from(value)),
        naga::Literal::AbstractInt(value) => Ok(value as f64),
        naga::Literal::Bool(value) => Ok(f64::from(u8::from(value))),
        _ => Err("uses a kind of number that GLSL shaders do not have".to_owned()),
    }
}
