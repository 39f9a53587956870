//! The operations of an expression as compiled by naga, evaluated in f64.

use std::collections::HashMap;

use naga::front::glsl;
use naga::{Handle, MathFunction};

/// Most operations of a text. The functions of the paper need four.
pub(super) const MAX_OPERATIONS: usize = 200;

/// Name of the GLSL function whose body the text is.
const FUNCTION: &str = "isotherm_share_done";
const MAX_TEXT: usize = 2000;

type ResultIndex = usize;

/// Source of the number in a slot.
#[derive(Debug, Clone)]
enum Operation {
    Constant(f64),
    Argument,
    Load(usize),
    Call(Call, ResultIndex),
    Negate(ResultIndex),
    Not(ResultIndex),
    Binary(Binary, ResultIndex, ResultIndex),
    Clamp(ResultIndex, ResultIndex, ResultIndex),
    Mix(ResultIndex, ResultIndex, ResultIndex),
    SmoothStep(ResultIndex, ResultIndex, ResultIndex),
    MultiplyAdd(ResultIndex, ResultIndex, ResultIndex),
    Select(ResultIndex, ResultIndex, ResultIndex),
    Same(ResultIndex),
}

type Call = fn(f64) -> f64;

#[derive(Debug, Clone, Copy)]
enum Binary {
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

#[derive(Debug, Clone)]
enum Statement {
    Set(ResultIndex, Operation),
    Store(usize, ResultIndex),
    If(ResultIndex, Vec<Statement>, Vec<Statement>),
    Return(ResultIndex),
}

#[derive(Debug, Clone)]
pub(crate) struct ExpressionProgram {
    body: Vec<Statement>,
    slots: usize,
    locals: usize,
}

impl ExpressionProgram {
    /// Compiles GLSL text of `s`.
    ///
    /// # Errors
    /// A message of naga, or an operation other than arithmetic.
    pub(crate) fn compile(text: &str) -> Result<Self, String> {
        check_text(text)?;
        // The text has a line of its own, so that naga's messages show only the text.
        let source =
            format!("#version 450\nfloat {FUNCTION}(float s) {{ return float(\n{text}\n); }}\nvoid main() {{}}\n");
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
        ExpressionReader { module: &module, function, slots: HashMap::new(), locals: HashMap::new(), operations: 0 }
            .program()
    }

    pub(crate) fn run(&self, s: f64) -> f64 {
        let (mut slots, mut locals) = (vec![0.0; self.slots], vec![0.0; self.locals]);
        run(&self.body, s, &mut slots, &mut locals).unwrap_or(f64::NAN)
    }
}

fn run(body: &[Statement], s: f64, slots: &mut [f64], locals: &mut [f64]) -> Option<f64> {
    for statement in body {
        match statement {
            Statement::Set(slot, operation) => slots[*slot] = evaluate(operation, s, slots, locals),
            Statement::Store(local, slot) => locals[*local] = slots[*slot],
            Statement::If(condition, accept, reject) => {
                let taken = if slots[*condition] != 0.0 { accept } else { reject };
                if let Some(value) = run(taken, s, slots, locals) {
                    return Some(value);
                }
            }
            Statement::Return(slot) => return Some(slots[*slot]),
        }
    }
    None
}

/// Truth values are 1 and 0.
fn evaluate(operation: &Operation, s: f64, slots: &[f64], locals: &[f64]) -> f64 {
    let truth = |value: bool| f64::from(u8::from(value));
    match *operation {
        Operation::Constant(value) => value,
        Operation::Argument => s,
        Operation::Load(local) => locals[local],
        Operation::Call(function, x) => function(slots[x]),
        Operation::Negate(x) => -slots[x],
        Operation::Not(x) => truth(slots[x] == 0.0),
        Operation::Clamp(x, low, high) => slots[x].max(slots[low]).min(slots[high]),
        Operation::Mix(x, y, share) => slots[x] * (1.0 - slots[share]) + slots[y] * slots[share],
        Operation::SmoothStep(low, high, x) => {
            let t = ((slots[x] - slots[low]) / (slots[high] - slots[low])).clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        }
        Operation::MultiplyAdd(x, y, z) => slots[x] * slots[y] + slots[z],
        Operation::Select(condition, accept, reject) => slots[if slots[condition] != 0.0 { accept } else { reject }],
        Operation::Same(x) => slots[x],
        Operation::Binary(name, x, y) => {
            let (x, y) = (slots[x], slots[y]);
            match name {
                Binary::Add => x + y,
                Binary::Subtract => x - y,
                Binary::Multiply => x * y,
                Binary::Divide => x / y,
                Binary::Remainder => x - y * (x / y).trunc(),
                Binary::Equal => truth(x == y),
                Binary::NotEqual => truth(x != y),
                Binary::Less => truth(x < y),
                Binary::LessEqual => truth(x <= y),
                Binary::And => truth(x != 0.0 && y != 0.0),
                Binary::Or => truth(x != 0.0 || y != 0.0),
                // As in GLSL it is defined for x >= 0.
                Binary::Pow => {
                    if x < 0.0 {
                        f64::NAN
                    } else {
                        x.powf(y)
                    }
                }
                Binary::Min => {
                    if y < x {
                        y
                    } else {
                        x
                    }
                }
                Binary::Max => {
                    if y > x {
                        y
                    } else {
                        x
                    }
                }
                Binary::Step => truth(y >= x),
                Binary::Atan2 => x.atan2(y),
            }
        }
    }
}

/// Refuses text that contains more than one expression.
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

struct ExpressionReader<'a> {
    module: &'a naga::Module,
    function: &'a naga::Function,
    slots: HashMap<Handle<naga::Expression>, ResultIndex>,
    locals: HashMap<Handle<naga::LocalVariable>, usize>,
    operations: usize,
}

impl ExpressionReader<'_> {
    fn program(mut self) -> Result<ExpressionProgram, String> {
        let mut body = Vec::new();
        // No statement emits these expressions: constants, arguments, variables.
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
        Ok(ExpressionProgram { body, slots, locals: self.locals.len() })
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

    fn slot(&self, handle: Handle<naga::Expression>) -> Result<ResultIndex, String> {
        self.slots.get(&handle).copied().ok_or_else(|| "may use single numbers only, no vectors".to_owned())
    }

    fn set(&mut self, handle: Handle<naga::Expression>, out: &mut Vec<Statement>) -> Result<(), String> {
        let expression = &self.function.expressions[handle];
        // Pointers are not numbers. Stores and loads use the variable itself.
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

    fn binary(&self, op: naga::BinaryOperator, x: ResultIndex, y: ResultIndex) -> Result<Operation, String> {
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
        if let Some(call) = call(fun) {
            return Ok(Operation::Call(call, x));
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

fn call(fun: MathFunction) -> Option<Call> {
    Some(match fun {
        MathFunction::Abs => f64::abs,
        MathFunction::Sign => |x| if x == 0.0 { 0.0 } else { x.signum() },
        MathFunction::Floor => f64::floor,
        MathFunction::Ceil => f64::ceil,
        MathFunction::Round => f64::round_ties_even,
        MathFunction::Trunc => f64::trunc,
        MathFunction::Fract => |x| x - x.floor(),
        MathFunction::Saturate => |x| x.clamp(0.0, 1.0),
        MathFunction::Radians => f64::to_radians,
        MathFunction::Degrees => f64::to_degrees,
        MathFunction::Sin => f64::sin,
        MathFunction::Cos => f64::cos,
        MathFunction::Tan => f64::tan,
        MathFunction::Asin => f64::asin,
        MathFunction::Acos => f64::acos,
        MathFunction::Atan => f64::atan,
        MathFunction::Sinh => f64::sinh,
        MathFunction::Cosh => f64::cosh,
        MathFunction::Tanh => f64::tanh,
        MathFunction::Asinh => f64::asinh,
        MathFunction::Acosh => f64::acosh,
        MathFunction::Atanh => f64::atanh,
        MathFunction::Exp => f64::exp,
        MathFunction::Exp2 => f64::exp2,
        MathFunction::Log => f64::ln,
        MathFunction::Log2 => f64::log2,
        MathFunction::Sqrt => f64::sqrt,
        MathFunction::InverseSqrt => |x| 1.0 / x.sqrt(),
        _ => return None,
    })
}

/// A literal as in the text: the shortest decimal of the f32 that naga stores.
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
