import * as vscode from "vscode";
import { LanguageClient, type LanguageClientOptions, type ServerOptions } from "vscode-languageclient/node";

let client: LanguageClient | undefined;
let studio: vscode.Terminal | undefined;

const program = (): string => vscode.workspace.getConfiguration("sentree").get<string>("program") || "sentree";

async function start(): Promise<void> {
  const server: ServerOptions = { command: program(), args: ["lsp"] };
  const options: LanguageClientOptions = {
    documentSelector: [
      { scheme: "file", pattern: "**/*.{xml,scxml,req,thrift}" },
      { scheme: "file", pattern: "**/sentree.yaml" },
      { scheme: "file", pattern: "**/{scenarios,world,verify}/*.yaml" },
    ],
  };
  client = new LanguageClient("sentree", "Sentree", server, options);
  try {
    await client.start();
  } catch {
    const choice = await vscode.window.showErrorMessage(
      `"${program()}" cannot be started. Install Sentree, or say where it is.`,
      "Settings",
    );
    if (choice) await vscode.commands.executeCommand("workbench.action.openSettings", "sentree.program");
  }
}

// A terminal that runs the program itself: no shell reads what a project is called.
function run(name: string, args: string[]): vscode.Terminal {
  const terminal = vscode.window.createTerminal({ name, shellPath: program(), shellArgs: args });
  terminal.show(true);
  return terminal;
}

// The folder of the sentree.yaml that belongs to the file in the editor.
async function projectFolder(): Promise<string | undefined> {
  let folder = vscode.window.activeTextEditor?.document.uri ?? vscode.workspace.workspaceFolders?.[0]?.uri;
  if (!folder || folder.scheme !== "file") return undefined;
  if (vscode.window.activeTextEditor) folder = vscode.Uri.joinPath(folder, "..");
  for (;;) {
    try {
      await vscode.workspace.fs.stat(vscode.Uri.joinPath(folder, "sentree.yaml"));
      return folder.fsPath;
    } catch {
      const above: vscode.Uri = vscode.Uri.joinPath(folder, "..");
      if (above.path === folder.path) break;
      folder = above;
    }
  }
  void vscode.window.showInformationMessage("There is no sentree.yaml here or in a folder above.");
  return undefined;
}

async function runMission(folder?: string, scenario?: string): Promise<void> {
  const project = folder ?? (await projectFolder());
  if (project) run("Sentree: run", ["run", project, "--live", ...(scenario ? ["--scenario", scenario] : [])]);
}

async function runTests(what?: string): Promise<void> {
  const project = what ?? (await projectFolder());
  if (project) run("Sentree: test", ["test", project]);
}

async function openStudio(folder?: string): Promise<void> {
  const project = folder ?? (await projectFolder());
  if (!project) return;
  studio?.dispose();
  studio = run("Sentree: studio", ["studio", project, "--open"]);
}

async function show(uri?: string, tree?: string): Promise<void> {
  const of = uri ?? vscode.window.activeTextEditor?.document.uri.toString();
  if (!of || !client) return;
  const svg: unknown = await client.sendRequest("workspace/executeCommand", {
    command: "sentree.draw",
    arguments: [of, tree ?? ""],
  });
  if (typeof svg !== "string") return;
  const title = tree || vscode.Uri.parse(of).path.split("/").pop() || "Sentree";
  const panel = vscode.window.createWebviewPanel("sentree.picture", title, vscode.ViewColumn.Beside, {});
  panel.webview.html =
    `<!DOCTYPE html><meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">` +
    `<body style="margin:0">${svg}</body>`;
}

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  context.subscriptions.push(
    vscode.commands.registerCommand("sentree.run", runMission),
    vscode.commands.registerCommand("sentree.test", runTests),
    vscode.commands.registerCommand("sentree.studio", openStudio),
    vscode.commands.registerCommand("sentree.show", show),
    vscode.commands.registerCommand("sentree.restart", async () => {
      await client?.stop();
      await start();
    }),
  );
  await start();
}

export async function deactivate(): Promise<void> {
  await client?.stop();
}
